"""A log in the formats of other tools and viewers, made from it at any time."""
