"""The layout attached to each log: a 3D view and the plots one looks at first, for Foxglove."""

import json

_PLOTS = {
    "Attitude error": ["/truth.attitude_error"],
    "Rate": [f"/truth.rate[{i}]" for i in range(3)],
    "Wheel speed": [f"/truth.wheel_speed[{i}]" for i in range(3)],
    "Commanded torque": [f"/command.torque[{i}]" for i in range(3)],
}


def layout(bus: str) -> bytes:
    """Return the layout as Foxglove and Lichtblick import it; the view follows the body ``bus``."""
    configs: dict[str, object] = {
        "3D!scene": {
            "followTf": bus,
            "followMode": "follow-position",
            "topics": {"/scene": {"visible": True}},
        }
    }
    plots = []
    for i, (title, paths) in enumerate(_PLOTS.items()):
        plots.append(f"Plot!{i}")
        configs[plots[i]] = {
            "foxglovePanelTitle": title,
            "paths": [
                {"value": p, "enabled": True, "timestampMethod": "receiveTime"} for p in paths
            ],
        }
    column = {"first": _pair(*plots[:2]), "second": _pair(*plots[2:]), "direction": "column"}
    tree = {"first": "3D!scene", "second": column, "direction": "row", "splitPercentage": 50}
    whole = {"configById": configs, "globalVariables": {}, "userNodes": {}, "layout": tree}
    return json.dumps(whole, indent=1).encode()


def _pair(first: str, second: str) -> dict[str, str]:
    return {"first": first, "second": second, "direction": "column"}
