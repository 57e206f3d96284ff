"""Studies behind the tables and pictures of the pages."""
