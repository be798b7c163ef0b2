"""What the environments of both tasks share: base classes, and kernels of the vector ones."""
