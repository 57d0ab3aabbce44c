"""Benchmarks: how accurate jaxgear is against finite elements, and how fast it is. Each runs with `python -m benchmarks.<name>`."""
