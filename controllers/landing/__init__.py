"""Landing on one gimballed engine: guidance, control and estimation."""
