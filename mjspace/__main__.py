"""``python -m mjspace``."""

from mjspace.cli import main

main()
