"""From via points to the shortest motion within the limits."""
