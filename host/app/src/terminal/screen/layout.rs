//! The steady screen's layout: what matters most is kept when the window is small.

use ballbar::Stillness;
use indicatif::HumanDuration;
use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Modifier, Style};
use ratatui::text::{Line, Span};
use ratatui::widgets::{Block, BorderType, Paragraph};

use super::gauge::gauge;
use super::picture::{Bar, Joint, Picture};
use crate::units::fixed;

/// Narrower windows have the bar under the joints.
const SIDE_BY_SIDE: u16 = 76;
/// Lines of the panels' borders, of the facts and of what to do next.
const OTHER_LINES: usize = 5;
/// Shorter gauges tell nothing.
const GAUGE: usize = 13;

/// A part of the screen, full width.
struct Part<'a> {
    /// The lower, the longer it is kept.
    rank: u8,
    height: u16,
    content: Content<'a>,
}

enum Content<'a> {
    Lines(Vec<Line<'a>>),
    Panels(Vec<Panel<'a>>),
    /// The latest of what was noted, as far as there is room.
    Notes,
}

struct Panel<'a> {
    title: String,
    lines: Vec<Line<'a>>,
}

/// Draws a picture, and the latest notes below it.
pub(super) fn draw(frame: &mut Frame<'_>, picture: &Picture, notes: &[String]) {
    let area = frame.area();
    let parts = fitting(parts(picture, area), area.height);
    let heights = parts.iter().map(|part| match part.content {
        Content::Notes => Constraint::Min(part.height),
        _ => Constraint::Length(part.height),
    });
    let rooms = Layout::vertical(heights).split(area);
    for (part, &room) in parts.into_iter().zip(rooms.iter()) {
        match part.content {
            Content::Lines(lines) => frame.render_widget(Paragraph::new(lines), room),
            Content::Panels(panels) => draw_panels(frame, panels, room),
            Content::Notes => {
                let inner = usize::from(room.height.saturating_sub(2));
                let mut lines: Vec<Line<'_>> =
                    notes.iter().flat_map(|note| wrap(words(note), " ", room.width.saturating_sub(4))).collect();
                lines.drain(..lines.len().saturating_sub(inner));
                draw_panels(frame, vec![Panel { title: "What happened".into(), lines }], room);
            }
        }
    }
}

/// Those parts, in their order, for which there is room after what matters more.
fn fitting(parts: Vec<Part<'_>>, height: u16) -> Vec<Part<'_>> {
    let mut by_rank: Vec<usize> = (0..parts.len()).collect();
    by_rank.sort_by_key(|&i| parts[i].rank);
    let mut left = height;
    let mut has_room = vec![false; parts.len()];
    for i in by_rank {
        // The first is shown as far as the window goes.
        has_room[i] = parts[i].height <= left || left == height;
        left = if has_room[i] { left.saturating_sub(parts[i].height) } else { left };
    }
    parts.into_iter().zip(has_room).filter_map(|(part, has_room)| has_room.then_some(part)).collect()
}

fn parts(picture: &Picture, Rect { width, height, .. }: Rect) -> Vec<Part<'_>> {
    let lines = |rank, lines: Vec<Line<'static>>| Part { rank, height: lines.len() as u16, content: Content::Lines(lines) };
    // In a low window the bar is kept longer than the joints, so it has a place of its own.
    let is_wide = width >= SIDE_BY_SIDE && usize::from(height) >= picture.joints.len() + OTHER_LINES;
    let inner = if is_wide { width / 2 } else { width }.saturating_sub(4);
    let joints = Panel { title: "Joints".into(), lines: joint_lines(&picture.joints, inner) };
    let name = picture.bar.name.as_ref().map_or("Bar".to_owned(), |name| format!("Bar {name}"));
    let bar = Panel { title: name, lines: bar_lines(&picture.bar, picture.tool_mm, inner) };
    let mut parts = vec![lines(6, vec![head(picture, width)])];
    if is_wide {
        parts.push(panels(3, vec![joints, bar]));
    } else {
        parts.extend([panels(4, vec![joints]), panels(2, vec![bar])]);
    }
    parts.push(lines(1, wrap(facts(picture), "   ", width)));
    if let Some(of) = picture.poses.of.filter(|&of| of > 0) {
        parts.push(lines(5, vec![progress(picture, of, width)]));
    }
    parts.push(lines(0, next(picture, width)));
    parts.push(Part { rank: 7, height: 4, content: Content::Notes });
    let keys = picture.keys.iter().map(|(key, what)| Span::from(format!("{key} {what}")).style(Modifier::DIM));
    parts.push(lines(8, wrap(keys.collect(), "   ", width)));
    parts
}

fn panels(rank: u8, panels: Vec<Panel<'_>>) -> Part<'_> {
    let height = panels.iter().map(|panel| panel.lines.len() as u16 + 2).max().unwrap_or(0);
    Part { rank, height, content: Content::Panels(panels) }
}

fn draw_panels(frame: &mut Frame<'_>, panels: Vec<Panel<'_>>, room: Rect) {
    let rooms = Layout::horizontal(panels.iter().map(|_| Constraint::Fill(1))).split(room);
    for (panel, &room) in panels.into_iter().zip(rooms.iter()) {
        let block = Block::bordered().border_type(BorderType::Rounded).title(format!(" {} ", panel.title));
        let block = block.border_style(Modifier::DIM).padding(ratatui::widgets::Padding::horizontal(1));
        frame.render_widget(Paragraph::new(panel.lines).block(block), room);
    }
}

fn head(picture: &Picture, width: u16) -> Line<'static> {
    let seconds = picture.elapsed.as_secs();
    let clock = format!("{}:{:02}:{:02}", seconds / 3600, seconds / 60 % 60, seconds % 60);
    let room = usize::from(width).saturating_sub(clock.len() + 1);
    let mut words = String::new();
    for word in &picture.head {
        let longer = if words.is_empty() { word.clone() } else { format!("{words}  {word}") };
        if longer.chars().count() <= room {
            words = longer;
        }
    }
    Line::from(vec![Span::from(format!("{words:room$} ")).style(Modifier::BOLD), clock.into()])
}

fn joint_lines(joints: &[Joint], width: u16) -> Vec<Line<'static>> {
    let line = |(i, joint): (usize, &Joint)| {
        let numbers = format!("{} {:>11}", i + 1, joint.text(joint.value));
        let mut line = Line::from(Span::from(numbers).style(Modifier::BOLD));
        let goal = joint.goal.map(|goal| format!(" → {:>11}", joint.text(goal)));
        if let Some(goal) = goal.filter(|goal| line.width() + goal.chars().count() <= usize::from(width)) {
            line.push_span(goal);
        }
        let room = usize::from(width).saturating_sub(line.width() + 2);
        if let Some(limits) = joint.limits.filter(|_| room >= GAUGE) {
            line.push_span(format!("  {}", gauge(room, limits, joint.value, joint.goal)));
        }
        line
    };
    joints.iter().enumerate().map(line).collect()
}

fn bar_lines(bar: &Bar, tool_mm: Option<[f64; 3]>, width: u16) -> Vec<Line<'static>> {
    let is_alone = |text: String| vec![Span::from(text).style(Modifier::BOLD)];
    let mut lines = match (bar.length_mm, bar.displacement_mm, bar.code) {
        (Some(length), Some(displacement), _) => vec![Line::from(vec![
            Span::from(format!("{} mm", fixed(length, 4))).style(Modifier::BOLD),
            format!("  {displacement:+.3}").into(),
        ])],
        (None, Some(displacement), _) => vec![Line::from(is_alone(format!("{displacement:+.4} mm from mid travel")))],
        (_, None, Some(code)) => vec![Line::from(is_alone(format!("code {code}")))],
        (_, None, None) => vec![Line::from(is_alone("no bar within its travel".into()))],
    };
    if let (Some([least, most]), Some(now)) = (bar.travel_mm, bar.displacement_mm) {
        if usize::from(width) >= GAUGE {
            lines.push(Line::from(gauge(usize::from(width), [least, most], now, Some(0.0))));
        }
        let (inwards, outwards) = (fixed(now - least, 1), fixed(most - now, 1));
        lines.push(Line::from(format!("{inwards} mm inwards, {outwards} mm outwards")));
    }
    lines.extend(tool_mm.map(|[x, y, z]| Line::from(format!("tool {x:.2}, {y:.2}, {z:.2} mm"))));
    lines
}

fn facts(picture: &Picture) -> Vec<Span<'static>> {
    let good = Style::from(Color::Green);
    let bad = Style::from(Color::Red).add_modifier(Modifier::BOLD);
    let mut facts = Vec::new();
    // Without a bar within its travel nothing settles, however still the arm stands.
    let is_measuring = picture.bar.displacement_mm.is_some() || picture.bar.code.is_some();
    facts.extend(picture.stillness.filter(|_| is_measuring).map(|stillness| match stillness {
        Stillness::Moving => Span::from("moving").style(Color::Yellow),
        Stillness::Settling => Span::from("settling").style(Color::Yellow),
        Stillness::Settled => Span::from("settled").style(good),
    }));
    facts.push(picture.rate_hz.map_or("no samples".into(), |hz| format!("{hz:.0} Hz").into()));
    let style = if picture.lost == 0 { good } else { bad };
    facts.push(Span::from(if picture.lost == 0 { "nothing lost".into() } else { format!("{} LOST", picture.lost) }).style(style));
    facts.extend(picture.is_homed.map(|is_homed| match is_homed {
        true => Span::from("homed").style(good),
        false => Span::from("NOT HOMED").style(bad),
    }));
    facts.push(picture.residual_mm.map_or("residual –".into(), |mm| format!("residual {mm:+.3} mm").into()));
    if picture.poses.of.is_none() {
        facts.push(format!("{} poses", picture.poses.done).into());
        facts.extend(picture.poses.left.map(|left| format!("{} left", HumanDuration(left)).into()));
    }
    facts
}

fn progress(picture: &Picture, of: u64, width: u16) -> Line<'static> {
    let done = picture.poses.done.min(of);
    let left = picture.poses.left.map_or(String::new(), |left| format!("  {} left", HumanDuration(left)));
    let words = format!("{done} of {of} poses");
    let room = usize::from(width).saturating_sub(words.chars().count() + left.chars().count() + 2);
    let full = (room as u64 * done / of) as usize;
    let bar = format!("  {}{}", "━".repeat(full), "─".repeat(room - full));
    Line::from(format!("{words}{bar}{left}"))
}

fn next(picture: &Picture, width: u16) -> Vec<Line<'static>> {
    let style = if picture.is_waiting { Style::from(Modifier::REVERSED | Modifier::BOLD) } else { Modifier::BOLD.into() };
    let pieces = [">".into()].into_iter().chain(words(&picture.next)).map(|piece| piece.style(style));
    wrap(pieces.collect(), " ", width)
}

fn words(text: &str) -> Vec<Span<'static>> {
    text.split_whitespace().map(|word| Span::from(word.to_owned())).collect()
}

/// Pieces in lines no longer than the window is wide.
fn wrap(pieces: Vec<Span<'static>>, between: &'static str, width: u16) -> Vec<Line<'static>> {
    let mut lines: Vec<Line<'static>> = Vec::new();
    for piece in pieces {
        match lines.last_mut() {
            Some(line) if line.width() + between.len() + piece.width() <= usize::from(width) => {
                line.push_span(Span::from(between).style(piece.style));
                line.push_span(piece);
            }
            _ => lines.push(Line::from(piece)),
        }
    }
    lines
}
