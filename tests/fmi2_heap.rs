//! `fmi2DoStep` and the calls around it take nothing from the heap; what an instance takes, it gives back.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
#![allow(unsafe_code)]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::ffi::{CString, c_void};
use std::ptr::{null, null_mut};

use eixo::fmi2::*;
use eixo::fmi3::*;
use eixo::variables::{Starts, all, guid};

thread_local! {
    static ALLOCATIONS: Cell<u64> = const { Cell::new(0) };
    static LIVE: Cell<i64> = const { Cell::new(0) };
}

struct Counting;

// SAFETY: hands everything on to the system's allocator.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.with(|n| n.set(n.get() + 1));
        LIVE.with(|n| n.set(n.get() + layout.size() as i64));
        // SAFETY: the caller's.
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        LIVE.with(|n| n.set(n.get() - layout.size() as i64));
        // SAFETY: the caller's.
        unsafe { System.dealloc(memory, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

const DT: f64 = 5.626e-4;

fn instance() -> *mut c_void {
    let guid = CString::new(guid(&Starts::default()).to_string()).unwrap();
    let callbacks =
        Callbacks { logger: None, allocate: None, free: None, step_finished: None, environment: null_mut() };
    // SAFETY: all pointers live through the call.
    let c = unsafe { fmi2Instantiate(c"axis".as_ptr(), 1, guid.as_ptr(), null(), &raw const callbacks, 0, 0) };
    assert!(!c.is_null());
    c
}

fn set(c: *mut c_void, name: &str, value: f64) {
    let v = all().find(|v| v.to_string() == name).unwrap_or_else(|| panic!("{name}"));
    // SAFETY: an instance, and one entry each.
    assert_eq!(unsafe { fmi2SetReal(c, &raw const v.reference, 1, &raw const value) }, 0, "{name}");
}

#[test]
fn a_step_takes_nothing_from_the_heap() {
    let everything: Vec<(String, f64)> = all()
        .filter(|v| v.reference >= 256 && v.start == Some(0.0) && v.max.is_some_and(|m| m > 0.0))
        .map(|v| (v.to_string(), (1e-3 * v.nominal).min(1e-3)))
        .collect();
    assert!(everything.len() > 20);
    for settings in [&[][..], &everything[..]] {
        let c = instance();
        settings.iter().for_each(|(name, value)| set(c, name, *value));
        // SAFETY: an instance; every array has the length given.
        unsafe {
            assert_eq!(fmi2SetupExperiment(c, 0, 0.0, 0.0, 0, 0.0), 0);
            assert_eq!(fmi2EnterInitializationMode(c), 0);
            assert_eq!(fmi2ExitInitializationMode(c), 0);
        }
        let (input, outputs, orders) = ([0_u32], [1_u32, 2, 3, 4, 5, 6, 7], [1; 7]);
        let mut values = [0.0; 7];
        let before = ALLOCATIONS.with(Cell::get);
        for k in 0..500 {
            let torque = 0.03 * (0.1 * f64::from(k)).sin();
            // SAFETY: as above.
            unsafe {
                assert_eq!(fmi2SetReal(c, input.as_ptr(), 1, &raw const torque), 0);
                assert_eq!(fmi2DoStep(c, f64::from(k) * DT, DT, 1), 0);
                assert_eq!(fmi2GetReal(c, outputs.as_ptr(), 7, values.as_mut_ptr()), 0);
                // Tuning, slopes, derivatives, and a refused step too.
                assert_eq!(fmi2SetReal(c, [8].as_ptr(), 1, &2.4e-4), 0);
                assert_eq!(fmi2SetRealInputDerivatives(c, input.as_ptr(), 1, [1].as_ptr(), &0.1), 0);
                let derivatives = values.as_mut_ptr();
                assert_eq!(fmi2GetRealOutputDerivatives(c, outputs.as_ptr(), 7, orders.as_ptr(), derivatives), 0);
                assert_eq!(
                    fmi2GetDirectionalDerivative(c, outputs.as_ptr(), 7, input.as_ptr(), 1, &1.0, derivatives),
                    0
                );
                assert_eq!(fmi2DoStep(c, -1.0, DT, 1), 3);
            }
        }
        assert_eq!(ALLOCATIONS.with(Cell::get), before);
        assert!(values.iter().all(|v| v.is_finite()));
        // SAFETY: an instance, freed once.
        unsafe { fmi2FreeInstance(c) };
    }
}

#[test]
fn what_an_instance_takes_it_gives_back_states_left_behind_included() {
    let before = LIVE.with(Cell::get);
    for round in 0..50 {
        let c = instance();
        let mut states = [null_mut(); 3];
        // SAFETY: an instance; valid places for the states.
        unsafe {
            assert_eq!(fmi2SetupExperiment(c, 0, 0.0, 0.0, 0, 0.0), 0);
            for state in &mut states {
                assert_eq!(fmi2GetFMUstate(c, state), 0);
            }
            // One freed by the importer, the others left to the instance.
            assert_eq!(fmi2FreeFMUstate(c, &raw mut states[round % 3]), 0);
            assert!(states[round % 3].is_null());
            // Pointers to something else are refused.
            let mut other: *mut c_void = (&raw mut states).cast();
            assert_eq!(fmi2SetFMUstate(c, other), 3);
            assert_eq!(fmi2FreeFMUstate(c, &raw mut other), 3);
            assert_eq!(fmi2GetFMUstate(c, &raw mut other), 3);
            fmi2FreeInstance(c);
        }
    }
    assert_eq!(LIVE.with(Cell::get), before);
}

#[test]
fn null_pointers_are_refused_everywhere() {
    let c = instance();
    let guid = CString::new(guid(&Starts::default()).to_string()).unwrap();
    let none = null_mut::<c_void>();
    // SAFETY: null pointers are what is tested; the rest are valid.
    unsafe {
        assert!(fmi2Instantiate(c"a".as_ptr(), 1, guid.as_ptr(), null(), null(), 0, 0).is_null());
        let callbacks =
            Callbacks { logger: None, allocate: None, free: None, step_finished: None, environment: null_mut() };
        assert!(fmi2Instantiate(null(), 1, guid.as_ptr(), null(), &raw const callbacks, 0, 0).is_null());
        assert!(fmi2Instantiate(c"a".as_ptr(), 1, null(), null(), &raw const callbacks, 0, 0).is_null());
        assert!(fmi2Instantiate(c"a".as_ptr(), 0, guid.as_ptr(), null(), &raw const callbacks, 0, 0).is_null());
        fmi2FreeInstance(null_mut());
        assert_eq!(fmi2DoStep(none, 0.0, DT, 1), 3);
        assert_eq!(fmi2Reset(none), 3);
        // Something that is no instance.
        let mut other = [0_u64; 4096];
        assert_eq!(fmi2Terminate(other.as_mut_ptr().cast()), 3);
        fmi2FreeInstance(other.as_mut_ptr().cast());
        assert_eq!(fmi2SetupExperiment(c, 0, 0.0, 0.0, 0, 0.0), 0);
        assert_eq!(fmi2EnterInitializationMode(c), 0);
        let vr = [0_u32];
        assert_eq!(fmi2GetReal(c, null(), 1, [0.0].as_mut_ptr()), 3);
        assert_eq!(fmi2GetReal(c, vr.as_ptr(), 1, null_mut()), 3);
        assert_eq!(fmi2GetReal(c, null(), 0, null_mut()), 0);
        assert_eq!(fmi2SetReal(c, vr.as_ptr(), 1, null()), 3);
        assert_eq!(fmi2SetInteger(c, null(), 1, null()), 3);
        assert_eq!(fmi2SetRealInputDerivatives(c, vr.as_ptr(), 1, null(), null()), 3);
        assert_eq!(fmi2GetFMUstate(c, null_mut()), 3);
        assert_eq!(fmi2SetFMUstate(c, null_mut()), 3);
        assert_eq!(fmi2FreeFMUstate(c, null_mut()), 3);
        let mut state = null_mut();
        // Freeing no state is allowed.
        assert_eq!(fmi2FreeFMUstate(c, &raw mut state), 0);
        assert_eq!(fmi2GetFMUstate(c, &raw mut state), 0);
        assert_eq!(fmi2SerializedFMUstateSize(c, state, null_mut()), 3);
        let mut size = 0;
        assert_eq!(fmi2SerializedFMUstateSize(c, state, &raw mut size), 0);
        assert_eq!(fmi2SerializeFMUstate(c, state, null_mut(), size), 3);
        let mut bytes = vec![0_i8; size];
        assert_eq!(fmi2SerializeFMUstate(c, state, bytes.as_mut_ptr(), size - 1), 3);
        assert_eq!(fmi2DeSerializeFMUstate(c, null(), size, &raw mut state), 3);
        assert_eq!(fmi2SetDebugLogging(c, 1, 1, null()), 3);
        assert_eq!(fmi2SetDebugLogging(c, 1, 1, [null()].as_ptr()), 3);
        assert_eq!(fmi2GetRealOutputDerivatives(c, vr.as_ptr(), 1, [1].as_ptr(), null_mut()), 3);
        assert_eq!(fmi2CancelStep(c), 3);
        assert_eq!(fmi2ExitInitializationMode(c), 0);
        assert_eq!(fmi2GetRealStatus(c, 2, null_mut()), 3);
        assert_eq!(fmi2GetStatus(c, 0, null_mut()), 2);
        fmi2FreeInstance(c);
    }
}

/// An instance by the ABI of FMI 3.0.
fn instance3() -> *mut c_void {
    let token = CString::new(guid(&Starts::default()).to_string()).unwrap();
    let (name, none) = (c"axis".as_ptr(), null_mut());
    // SAFETY: all pointers live through the call.
    let c =
        unsafe { fmi3InstantiateCoSimulation(name, token.as_ptr(), null(), 0, 0, 0, 0, null(), 0, none, None, null()) };
    assert!(!c.is_null());
    c
}

#[test]
fn a_step_of_fmi_3_takes_nothing_from_the_heap_either() {
    let c = instance3();
    let (outputs, mut values) = ([1_u32, 2, 3, 4, 5, 6, 7], [0.0; 7]);
    // SAFETY: an instance; every array has the length given.
    unsafe {
        assert_eq!(fmi3EnterInitializationMode(c, 0, 0.0, 0.0, 0, 0.0), 0);
        assert_eq!(fmi3ExitInitializationMode(c), 0);
        let before = ALLOCATIONS.with(Cell::get);
        for k in 0..500 {
            let (torque, point) = (0.03 * (0.1 * f64::from(k)).sin(), f64::from(k) * DT);
            let (mut event, mut end, mut early, mut last) = (9, 9, 9, -1.0);
            let (e, t, r, l) = (&raw mut event, &raw mut end, &raw mut early, &raw mut last);
            assert_eq!(fmi3SetFloat64(c, [0].as_ptr(), 1, &raw const torque, 1), 0);
            assert_eq!(fmi3DoStep(c, point, DT, 1, e, t, r, l), 0);
            assert_eq!((event, end, early), (0, 0, 0));
            assert!((last - point - DT).abs() < 1e-12);
            assert_eq!(fmi3GetFloat64(c, outputs.as_ptr(), 7, values.as_mut_ptr(), 7), 0);
            assert_eq!(fmi3GetOutputDerivatives(c, outputs.as_ptr(), 7, [1; 7].as_ptr(), values.as_mut_ptr(), 7), 0);
            // Refused, in two ways.
            assert_eq!(fmi3DoStep(c, -1.0, DT, 1, e, t, r, l), 3);
            assert_eq!(fmi3GetFloat64(c, outputs.as_ptr(), 7, values.as_mut_ptr(), 6), 3);
        }
        assert_eq!(ALLOCATIONS.with(Cell::get), before);
        fmi3FreeInstance(c);
    }
    assert!(values.iter().all(|v| v.is_finite()));
}

#[test]
fn null_pointers_and_modes_that_are_not_there_are_refused_in_fmi_3() {
    let c = instance3();
    let token = CString::new(guid(&Starts::default()).to_string()).unwrap();
    let (name, none) = (c"a".as_ptr(), null_mut());
    // SAFETY: null pointers are what is tested; the rest are valid.
    unsafe {
        let make = |name, token, event| {
            fmi3InstantiateCoSimulation(name, token, null(), 0, 0, event, 0, null(), 0, none, None, null())
        };
        assert!(make(null(), token.as_ptr(), 0).is_null());
        assert!(make(name, null(), 0).is_null());
        assert!(make(name, token.as_ptr(), 1).is_null(), "event mode");
        assert!(make(c" ".as_ptr(), token.as_ptr(), 0).is_null());
        fmi3FreeInstance(null_mut());
        assert_eq!(fmi3Reset(null_mut()), 3);
        assert_eq!(fmi3EnterEventMode(c), 3);
        assert_eq!(fmi3EnterConfigurationMode(c), 3);
        assert_eq!(fmi3EnterInitializationMode(c, 0, 0.0, f64::NAN, 0, 0.0), 3);
        assert_eq!(fmi3EnterInitializationMode(c, 0, 0.0, 1.0, 1, 1.0), 3);
        assert_eq!(fmi3EnterInitializationMode(c, 0, 0.0, 0.0, 0, 0.0), 0);
        assert_eq!(fmi3GetFloat64(c, null(), 1, [0.0].as_mut_ptr(), 1), 3);
        assert_eq!(fmi3GetFloat64(c, null(), 0, null_mut(), 0), 0);
        assert_eq!(fmi3SetFloat64(c, [0].as_ptr(), 1, null(), 1), 3);
        assert_eq!(fmi3GetBoolean(c, [0].as_ptr(), 1, [0].as_mut_ptr(), 1), 3);
        assert_eq!(fmi3GetClock(c, [0].as_ptr(), 1, [0].as_mut_ptr()), 3);
        assert_eq!(fmi3ExitInitializationMode(c), 0);
        let mut last = 0.0;
        assert_eq!(fmi3DoStep(c, 0.0, DT, 1, null_mut(), null_mut(), null_mut(), &raw mut last), 3);
        // Nothing was done.
        let mut flags = [7_u8; 3];
        let [e, t, r] = &mut flags;
        assert_eq!(fmi3DoStep(c, 0.0, DT, 1, e, t, r, &raw mut last), 0);
        fmi3FreeInstance(c);
    }
}
