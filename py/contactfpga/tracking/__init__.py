"""Contacts over time: ids that stay, from the zones of one frame after the other."""
