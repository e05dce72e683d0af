//! Pages and plots about an asset
