"""Pictures and reports; each function takes a value object and an axis and returns artists."""
