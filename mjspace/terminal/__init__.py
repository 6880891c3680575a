"""What the command line shows: options, progress, reports of errors."""
