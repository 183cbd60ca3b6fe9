//! A step of a sweep: a scene, a view, and the work that they ask for.

use super::asked::Content;
use splatkit::{
    Result,
    math::Camera,
    scene::{Scene, Settings},
};
use std::{cell::RefCell, rc::Rc};

pub struct Step {
    pub scene: Scene,
    pub content: Content,
    pub camera: Camera,
    pub settings: Settings,
}

/// A step before its scene is made.
pub struct Plan {
    pub name: String,
    /// The index of the step that it is compared with; `None` for the first.
    pub against: Option<usize>,
    pub make: Box<dyn Fn() -> Result<Step>>,
}

impl Plan {
    pub fn new(name: impl Into<String>, make: impl Fn() -> Result<Step> + 'static) -> Self {
        Self { name: name.into(), against: None, make: Box::new(make) }
    }
}

/// Orders the steps: each is compared with the one before it.
pub fn in_order(mut plans: Vec<Plan>) -> Vec<Plan> {
    for (at, plan) in plans.iter_mut().enumerate() {
        plan.against = at.checked_sub(1);
    }
    plans
}

/// Leaves the steps without an order: each is compared with the first.
pub fn with_first(mut plans: Vec<Plan>) -> Vec<Plan> {
    plans.iter_mut().skip(1).for_each(|plan| plan.against = Some(0));
    plans
}

/// Pairs the steps: the second of each pair is compared with the first.
pub fn in_pairs(mut plans: Vec<Plan>) -> Vec<Plan> {
    for (at, plan) in plans.iter_mut().enumerate() {
        plan.against = (at % 2 == 1).then(|| at - 1);
    }
    plans
}

/// A value that several steps use and that is made once.
pub type Shared<T> = Rc<dyn Fn() -> Result<T>>;

pub fn shared<T: Clone + 'static>(make: impl Fn() -> Result<T> + 'static) -> Shared<T> {
    let kept: RefCell<Option<T>> = RefCell::new(None);
    Rc::new(move || {
        if let Some(made) = &*kept.borrow() {
            return Ok(made.clone());
        }
        let made = make()?;
        *kept.borrow_mut() = Some(made.clone());
        Ok(made)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn against(order: fn(Vec<Plan>) -> Vec<Plan>) -> Vec<Option<usize>> {
        let plan =
            |name: &str| Plan::new(name, || Err(splatkit::Error::NothingToDraw(String::new())));
        order(["a", "b", "c", "d"].map(plan).into()).iter().map(|plan| plan.against).collect()
    }

    #[test]
    fn steps_have_neighbours() {
        assert_eq!(against(in_order), [None, Some(0), Some(1), Some(2)]);
        assert_eq!(against(with_first), [None, Some(0), Some(0), Some(0)]);
        assert_eq!(against(in_pairs), [None, Some(0), None, Some(2)]);
    }

    #[test]
    fn what_is_shared_is_made_once() {
        let made = Rc::new(RefCell::new(0));
        let counted = made.clone();
        let number = shared(move || {
            *counted.borrow_mut() += 1;
            Ok(7)
        });
        assert_eq!((number().unwrap(), number().unwrap(), *made.borrow()), (7, 7, 1));
    }
}
