// The one file of the target that makes the precompiled header of all tests.
