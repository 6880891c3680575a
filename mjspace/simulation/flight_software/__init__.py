"""Flight software in other languages: what passes to it and back, and how it is called."""
