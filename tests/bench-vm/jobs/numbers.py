#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: Apache-2.0
"""usage: numbers.py FILE KEY...    values of a JSON file, one a line; KEY is level.level.name"""

import json
import sys


def value(document, key):
    for part in key.split("."):
        document = document[part]
    return document


def main():
    with open(sys.argv[1], encoding="utf-8") as file:
        document = json.load(file)
    for key in sys.argv[2:]:
        print(json.dumps(value(document, key)))


if __name__ == "__main__":
    main()
