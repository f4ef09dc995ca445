"""The random walk behind the equation (3.1, 3.3): killed, conditioned, and watched over time."""
