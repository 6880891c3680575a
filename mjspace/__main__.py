"""``python -m mjspace``, and the command ``mjspace``."""

from mjspace.interrupts import ended_by_signals


def main() -> None:
    """Run the command line, of which nothing has been imported yet; the entry point."""
    with ended_by_signals():
        from mjspace.cli import main as command_line

        command_line()


if __name__ == "__main__":
    main()
