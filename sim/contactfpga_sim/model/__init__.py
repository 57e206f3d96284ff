"""What the gateware is held against: golden model, simulated sheet, scenes, virtual board."""
