"""Choices of a Skin: labellers, scans, debounces and reports, each registered in one place.

A choice holds what all parts of the project need: its name, its title in charts, its bounds, its requirements, and the
places of its gateware and its golden rule. These two stay apart and are loaded on demand.
"""
