"""The version of this package, as in Cargo.toml: to look it up among what is installed takes as long as the rest of the command."""

VERSION = "0.1.0"
