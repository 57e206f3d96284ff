"""Contacts over time with constant ids."""
