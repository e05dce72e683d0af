//! From an asset to a picture
