"""JSON as its standard has it."""

import json


def strict_json(path):
    """Reads a file; NaN and infinity, which Python writes and JSON lacks, are errors."""

    def refuse(token):
        raise AssertionError(f"{token} is not JSON")

    return json.loads(path.read_text(), parse_constant=refuse)
