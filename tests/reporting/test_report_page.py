"""A page: control characters written out, and numbers that a browser gets as they were."""

import base64
import json
from pathlib import Path

import numpy as np
import pytest
from jinja2 import DictLoader

from mjspace.reporting import page
from mjspace.reporting.charts import Bound, Chart, Series, data
from mjspace.reporting.charts import _packed as packed


def test_control_characters_are_written_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    hidden = "a\x1b[31m\u202eb<"
    chart = Chart(hidden, hidden, [Series(hidden, np.zeros(2), np.zeros(2), 0)])
    text = json.dumps(data([chart]))
    assert "\\\\x1b[31m\\\\u202eb<" in text
    assert "\\u001b" not in text

    output = tmp_path / "x.html"
    monkeypatch.setattr(page, "PackageLoader", lambda _: DictLoader({"x": "{{ text }}"}))
    page.write(output, "x", [], text=hidden)
    assert output.read_text() == "a\\x1b[31m\\u202eb&lt;"


@pytest.mark.parametrize("log_scale", [False, True])
@pytest.mark.parametrize(
    ("values", "flat"),
    [
        (np.array([1e-14, 1.0, 3e5]), False),
        (np.array([6.7e6 + 0.001, 6.7e6 + 0.002, 6.7e6]), True),
        (np.array([np.nan, 2.0, np.inf]), True),
        (np.array([np.nan]), False),
    ],
)
def test_packed_numbers_keep_seven_digits_of_what_varies(
    values: np.ndarray, flat: bool, log_scale: bool
) -> None:
    found = packed(values, log_scale)
    single = np.frombuffer(base64.b64decode(found["data"]), "<f4").astype(float)
    good = np.isfinite(values)
    assert (np.isfinite(single) == good).all()
    values, back = values[good], found["base"] + single[good]
    assert (found["base"] != 0.0) == (flat and not log_scale)
    size = np.ptp(values) if found["base"] else np.abs(values)
    # Single precision has 24 bits: half a unit of the last is 6e-8; of doubles it is 1.1e-16.
    assert (np.abs(back - values) <= 6e-8 * size + 2.3e-16 * np.abs(values)).all()


def test_arrays_that_are_equal_are_there_once() -> None:
    time = np.linspace(0.0, 1.0, 5)
    lines = [Series(name, time.copy(), time + number, number) for number, name in enumerate("xy")]
    bound = Bound("final < 2", (0.0, 2.0), (np.inf, 2.0))
    found = data([Chart("t", "m", lines, bounds=[bound])])
    assert len(found["arrays"]) == 2
    assert found["charts"][0]["bounds"][0]["to"] == [None, 2.0]
