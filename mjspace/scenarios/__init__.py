"""The scenarios that come with mjspace, one TOML file each."""
