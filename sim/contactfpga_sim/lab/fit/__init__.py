"""The cheapest Skin that meets stated errors and a stated time on given scenes."""
