"""The page that `facade view` writes: template, viewer, three.js (see README.md here)."""
