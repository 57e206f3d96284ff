"""Tools for people: commands, the view in the browser, recordings."""
