"""What a Skin can choose from: labellers, scans, debounces and reports, each registered in one place.

A choice holds what all parts of the project need to know of it: its name, its title in charts, its bounds, what a Skin
must fulfill, and where its gateware and its golden rule are. These two stay apart and are loaded only when needed.
"""
