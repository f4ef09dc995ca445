"""The shape index: codes with what belongs to them in a database, kept up to date and searched."""
