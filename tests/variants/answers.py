"""Answers as a model might write them."""

from __future__ import annotations

import json


def agent(**changes: object) -> dict[str, object]:
    made: dict[str, object] = {
        "id": "Agent2",
        "type": "VEHICLE",
        "x_m": 21.4,
        "y_m": 0.9,
        "heading_rad": 0.0,
        "width_m": 2.0,
        "length_m": 4.8,
        "speed_mps": 0.0,
        "lane": "Lane1",
    }
    return {key: value for key, value in (made | changes).items() if value is not ...}


def block(*added: dict[str, object], **changes: object) -> str:
    return json.dumps({"add": list(added), "move": [], "remove": []} | changes)


def answer(json_block: str) -> str:
    return f"""Insights: One road, two lanes.

Summary: A parked car ahead.

Modification Dict: {{"Action": "add", "Modified_Agent": "Agent2"}}

Modification Calculations:
Step 1: 21.4 m ahead of the ego.

Modified Vectors:
```json
{json_block}
```
"""


GOOD = answer(block(agent()))
