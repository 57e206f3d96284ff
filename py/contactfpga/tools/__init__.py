"""What a person uses: commands, the view in the browser, recordings."""
