"""Writers of the pages: a module per page, each run by a make target."""
