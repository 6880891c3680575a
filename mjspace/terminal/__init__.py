"""The command line's options, progress bars and error reports."""
