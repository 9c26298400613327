"""Prints the metadata of the parameters as JSON: `python -m sitl.mavlink.component_metadata`."""

import json
import sys

from sitl.mavlink.component_metadata.parameters import parameter_metadata

if __name__ == "__main__":
    sys.stdout.write(json.dumps(parameter_metadata(), indent=2, ensure_ascii=False) + "\n")
