"""The paper reproduced: its figures, tables and claims, made again and judged."""
