use embedded_can::nb::Can;
use gyronet::sensor::Source;
use gyronet::{Coprocessor, ImuSample, Micros, TransmitQueue, WindowNetwork};

/// Runs everything that is due. Call it every few milliseconds; `now` is your clock. Errors are counted and reported
/// on the bus.
pub fn poll<CAN: Can>(
    coprocessor: &mut Coprocessor,
    network: &mut impl WindowNetwork,
    imu: &mut impl Source<Sample = ImuSample>,
    queue: &mut TransmitQueue<CAN::Frame, 24>,
    can: &mut CAN,
    now: Micros,
) {
    match imu.next_sample() {
        Some(Ok(sample)) => drop(coprocessor.imu(sample, now, queue)),
        Some(Err(_)) => coprocessor.imu_error(),
        // This also reports a silent sensor.
        None => drop(coprocessor.poll(now, queue)),
    }
    // This can run in a task of lower priority: the estimate is used two samples later, not before.
    if let Some(window) = coprocessor.window() {
        let _ = coprocessor.deliver(window.end, network.estimate(&window.features));
    }
    queue.service(can);
}
