"""Training of gyronet's networks: recordings in, checkpoint and golden tensors out."""
