"""Parts of the comparison of optimization methods, `benchmarks.optimizers`."""
