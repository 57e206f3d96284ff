"""Size and clock by place and route."""
