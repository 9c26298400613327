"""Outside controllers: servo outputs in, the vehicle's true state and sensor readings out."""
