"""What pictures are put together from: colours, numbers, legends, frames of an animation."""
