"""Host side: read contact zones from a sheet of switches."""
