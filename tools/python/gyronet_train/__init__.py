"""Training of gyronet's networks: from recordings to a checkpoint and golden tensors."""
