"""Writes docs/validation.md and its figures from what ``mjspace validate`` measured.

Usage: python tools/validation_page.py validation.json docs/validation.md
"""

import sys
from pathlib import Path

from mjspace.validation import report
from mjspace.validation.results import Results

if __name__ == "__main__":
    data, page = map(Path, sys.argv[1:])
    report.write_markdown(Results.model_validate_json(data.read_text()), page)
