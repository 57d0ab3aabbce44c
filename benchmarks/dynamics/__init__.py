"""How accurate the dynamics are and what they cost: `python -m benchmarks.dynamics`."""
