//! Identification: regressors, estimators, modal parameters, excitation estimate.
