//! Stands outside and measures; nothing inside knows of it.
