"""The sweep's engine on a CUDA device."""
