"""Many boards through one Zenoh router: frames, losses, processor time and latency, beside a bare pair of Zenoh."""
