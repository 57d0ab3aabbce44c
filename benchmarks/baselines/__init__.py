"""The loaded tooth contact analysis written otherwise: NumPy, SciPy and C, for the throughput benchmark."""
