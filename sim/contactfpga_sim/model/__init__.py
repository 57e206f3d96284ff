"""References for the gateware: golden model, simulated sheet, scenes, virtual board."""
