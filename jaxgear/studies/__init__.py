"""Studies of a design file: worked out, summed up, tabulated and drawn, with or without the command line."""
