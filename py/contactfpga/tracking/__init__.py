"""Contacts over time, with constant ids, from successive frames' zones."""
