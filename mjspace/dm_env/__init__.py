"""The scenarios as dm_control environments."""
