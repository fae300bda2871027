//! A model whose declared part and effects are all linear: measured points and terms.
