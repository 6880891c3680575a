"""Control of permanent-magnet synchronous motors: current and speed loops, observers."""
