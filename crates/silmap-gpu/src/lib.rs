//! Device, capability tier, read-back and shaders; knows nothing of silhouettes
