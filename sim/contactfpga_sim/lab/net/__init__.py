"""Many boards through one Zenoh router, against a bare Zenoh pair."""
