"""The cheapest Skin that meets limits of errors and time on given scenes."""
