"""gnm/PatternTrial-v0: single environment, vector environment, and its compiled kernels."""
