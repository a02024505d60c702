//! Recording of work for the device, and the time it takes.

use cloth_core::{Result, StageTime};

use crate::{
    device::{DeviceContext, Kernel},
    dispatch::Groups,
    readback::Readback,
};

/// Work that is recorded but not yet handed over. All dispatches go into one pass; with times taken, into one for each row of
/// dispatches of the same stage, as times are those of passes.
#[derive(Debug)]
pub(crate) struct Recorder {
    encoder: Option<wgpu::CommandEncoder>,
    pass: Option<wgpu::ComputePass<'static>>,
    clock: Option<Clock>,
    /// Dispatches at which what is recorded is handed over early, if that is to be.
    early: Option<u32>,
    /// Dispatches recorded since the last call of `submit`.
    count: u32,
}

/// Dispatches after which the first work is handed over early: what the device has to do for as long as the host
/// takes for some tens more.
const EARLY_FIRST: u32 = 10;
/// How much more of them there are the next time.
const EARLY_GROWTH: u32 = 4;

/// Time stamps of passes.
#[derive(Debug)]
struct Clock {
    queries: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    readback: Readback,
    /// The stage of each pair of time stamps taken since the last submission.
    stages: Vec<&'static str>,
    times: Vec<StageTime>,
}

/// Passes whose times are taken in one submission.
const CLOCK_PASSES: u32 = 1024;
/// Bytes of all time stamps.
const CLOCK_SIZE: u64 = 2 * CLOCK_PASSES as u64 * wgpu::QUERY_SIZE as u64;

impl Recorder {
    /// With `is_early` the device begins with the first work while more is recorded: worth it where the host waits for the
    /// end of a frame before it records another one.
    pub(crate) fn new(context: &DeviceContext, is_early: bool) -> Self {
        let clock = context.stage_times().then(|| Clock {
            queries: context.device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("stage times"),
                ty: wgpu::QueryType::Timestamp,
                count: 2 * CLOCK_PASSES,
            }),
            resolved: context.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("stage times"),
                size: CLOCK_SIZE,
                usage: wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC,
                mapped_at_creation: false,
            }),
            readback: Readback::new(context, CLOCK_SIZE),
            stages: Vec::new(),
            times: Vec::new(),
        });
        let early = is_early.then_some(EARLY_FIRST);
        Self { encoder: None, pass: None, clock, early, count: 0 }
    }

    /// Whether nothing is recorded.
    pub(crate) const fn is_empty(&self) -> bool {
        self.encoder.is_none()
    }

    fn encoder<'a>(
        slot: &'a mut Option<wgpu::CommandEncoder>,
        context: &DeviceContext,
    ) -> &'a mut wgpu::CommandEncoder {
        slot.get_or_insert_with(|| {
            context
                .device
                .create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("cloth") })
        })
    }

    /// Records a dispatch; its time counts for `stage`.
    pub(crate) fn dispatch(
        &mut self,
        context: &DeviceContext,
        stage: &'static str,
        kernel: &Kernel,
        bind_group: &wgpu::BindGroup,
        offsets: &[u32],
        groups: Groups,
    ) -> Result<()> {
        if self.clock.as_ref().is_some_and(|clock| clock.stages.last() != Some(&stage)) {
            self.pass = None;
        }
        if self.pass.is_none() && self.clock.as_ref().is_some_and(Clock::is_full) {
            self.submit(context)?;
        }
        let Self { encoder, pass, clock, .. } = self;
        let timed = clock.is_some();
        let pass = pass.get_or_insert_with(|| {
            let timestamp_writes = clock.as_mut().map(|clock| clock.begin(stage));
            let descriptor = wgpu::ComputePassDescriptor { label: None, timestamp_writes };
            Self::encoder(encoder, context).begin_compute_pass(&descriptor).forget_lifetime()
        });
        pass.set_pipeline(&kernel.pipeline);
        pass.set_bind_group(0, bind_group, offsets);
        pass.dispatch_workgroups(groups[0], groups[1], 1);
        self.count += 1;
        if !timed && self.early == Some(self.count) {
            self.early = Some(self.count * EARLY_GROWTH);
            return self.hand_over(context);
        }
        Ok(())
    }

    /// Records a copy of `size` bytes.
    pub(crate) fn copy(
        &mut self,
        context: &DeviceContext,
        source: &wgpu::Buffer,
        source_offset: u64,
        target: &wgpu::Buffer,
        target_offset: u64,
        size: u64,
    ) {
        self.pass = None;
        let encoder = Self::encoder(&mut self.encoder, context);
        encoder.copy_buffer_to_buffer(source, source_offset, target, target_offset, Some(size));
    }

    /// Records that all of a buffer becomes zero.
    pub(crate) fn clear(&mut self, context: &DeviceContext, buffer: &wgpu::Buffer) {
        self.pass = None;
        Self::encoder(&mut self.encoder, context).clear_buffer(buffer, 0, None);
    }

    /// Hands everything recorded to the device.
    ///
    /// # Errors
    /// What the device reports.
    pub(crate) fn submit(&mut self, context: &DeviceContext) -> Result<()> {
        self.count = 0;
        self.early = self.early.map(|_| EARLY_FIRST);
        self.hand_over(context)
    }

    fn hand_over(&mut self, context: &DeviceContext) -> Result<()> {
        self.pass = None;
        let Some(mut encoder) = self.encoder.take() else { return context.faults.check() };
        match self.clock.as_mut().filter(|clock| !clock.stages.is_empty()) {
            Some(clock) => {
                let count = 2 * clock.stages.len() as u32;
                encoder.resolve_query_set(&clock.queries, 0..count, &clock.resolved, 0);
                let size = u64::from(count * wgpu::QUERY_SIZE);
                encoder.copy_buffer_to_buffer(
                    &clock.resolved,
                    0,
                    clock.readback.buffer(),
                    0,
                    Some(size),
                );
                context.submit(encoder.finish())?;
                clock.take(context, size)
            }
            None => context.submit(encoder.finish()),
        }
    }

    /// Times by stage since the last call.
    pub(crate) fn stage_times(&mut self) -> Vec<StageTime> {
        self.clock.as_mut().map_or_else(Vec::new, |clock| std::mem::take(&mut clock.times))
    }
}

impl Clock {
    const fn is_full(&self) -> bool {
        self.stages.len() as u32 == CLOCK_PASSES
    }

    /// What a pass of a stage writes.
    fn begin(&mut self, stage: &'static str) -> wgpu::ComputePassTimestampWrites<'_> {
        let first = 2 * self.stages.len() as u32;
        self.stages.push(stage);
        wgpu::ComputePassTimestampWrites {
            query_set: &self.queries,
            beginning_of_pass_write_index: Some(first),
            end_of_pass_write_index: Some(first + 1),
        }
    }

    /// Waits for the time stamps and adds them up.
    fn take(&mut self, context: &DeviceContext, size: u64) -> Result<()> {
        let period = f64::from(context.queue.get_timestamp_period());
        let stages = std::mem::take(&mut self.stages);
        let times = &mut self.times;
        self.readback.read(context, size, |bytes| {
            let stamps: Vec<u64> = bytemuck::pod_collect_to_vec(bytes);
            for (index, stage) in stages.into_iter().enumerate() {
                // The begin of the next pass, if there is one, else the end of this: what is between passes takes time, too.
                let [begin, end, next] = [0, 1, 2].map(|at| stamps.get(2 * index + at).copied());
                let ticks = next.or(end).unwrap_or(0).saturating_sub(begin.unwrap_or(0));
                let time = std::time::Duration::from_nanos((ticks as f64 * period) as u64);
                match times.iter_mut().find(|entry| entry.stage == stage) {
                    Some(entry) => entry.time += time,
                    None => times.push(StageTime { stage, time }),
                }
            }
        })
    }
}
