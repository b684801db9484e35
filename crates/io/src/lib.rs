//! Scene, picture, model and solution files.
