"""Many boards through one Zenoh router: frames, losses, CPU time and latency, against a bare Zenoh pair."""
