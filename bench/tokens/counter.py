"""Counts tokens in an environment of its own: a JSON list of texts in, a list of numbers out."""

import importlib
import json
import sys

if __name__ == "__main__":
    counted = importlib.import_module("toktok").batch_count(json.load(sys.stdin), sys.argv[1])
    print(json.dumps(counted))
