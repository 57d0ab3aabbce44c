"""How accurate jaxgear is against finite elements. Run with `python -m benchmarks.accuracy`."""
