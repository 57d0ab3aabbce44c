"""`python -m jaxgear.io` prints every table and key of a design file, with `keys` their names as JSON."""

import json
import sys

from .reference import known_keys, reference

if sys.argv[1:] == ["keys"]:
    print(json.dumps(known_keys(), indent=1))
else:
    print(reference(), end="")
