"""The facade: one short call for each step, over the objects of the stages."""
